"""The Lua script for the autopilot, run in Lua against stand-ins for what ArduPilot gives a script."""

from __future__ import annotations

from pathlib import Path

from lupa import lua53  # ArduPilot's Lua is 5.3

SCRIPT = Path(__file__).parents[3] / "docs" / "sensor" / "ardupilot_no2.lua"

# Methods take themselves first (a colon in Lua); numbers of 32 bits are objects, as in ArduPilot.
STAND_INS = """
local function u32(number) return {toint = function() return number end} end
millis = function() return u32(py.now_ms()) end
gcs = {
  send_named_float = function(_, name, value) py.named(name, value) end,
  send_text = function(_, severity, text) py.text(severity, text) end,
}
ahrs = {get_location = function(_)
  if not py.has_place() then return nil end
  local function is(number) return function() return number end end
  return {lat = is(252600000), lng = is(515000000), alt = is(7250)}
end}
logger = {write = function(_, ...) py.logged(table.unpack({...})) end}
serial = {find_serial = function(_, number)
  if number ~= 0 or not py.has_port() then return nil end
  return {
    begin = function(_, baud) py.begin(baud) end,
    set_flow_control = function() end,
    available = function() return u32(py.waiting()) end,
    readstring = function(_, count) return py.read(count) end,
  }
end}
"""


class Board:
    """What the script sees of an autopilot."""

    def __init__(self, *, has_port=True):
        self.ms, self.waits, self.port, self.place = 0, b"", has_port, True
        self.values, self.texts, self.log, self.baud = [], [], [], None
        self.lua = lua53.LuaRuntime(encoding=None)
        functions = {
            b"now_ms": lambda: self.ms,
            b"named": lambda name, value: self.values.append((name, value)),
            b"text": lambda severity, text: self.texts.append((severity, text.decode())),
            b"has_place": lambda: self.place,
            b"logged": lambda *values: self.log.append(values),
            b"has_port": lambda: self.port,
            b"begin": lambda baud: setattr(self, "baud", baud),
            b"waiting": lambda: len(self.waits),
            b"read": self.read,
        }
        self.lua.globals()[b"py"] = self.lua.table_from(functions)
        self.lua.execute(STAND_INS.encode())
        returned = self.lua.execute(SCRIPT.read_bytes())
        self.update = returned[0] if returned else None

    def read(self, count):
        taken, self.waits = self.waits[:count], self.waits[count:]
        return taken

    def hear(self, data=b"", passed_ms=100):
        """Let bytes arrive and time pass; the script says itself when it wants to be called next."""
        self.waits += data
        self.ms += passed_ms
        self.update, wait_ms = self.update()
        assert 0 < wait_ms <= 1000


def test_values_go_to_the_telemetry_and_with_the_position_into_the_log():
    board = Board()
    assert board.baud == 9600
    board.hear(b"2=99\r\nNO2=31.5\r\nNO2=3")  # the first line began before we listened
    assert board.values == [(b"NO2", 31.5)]
    board.hear(b"2.25\r\n")
    board.hear(b"temp=20\nNO2=nan\nNO2=1e9\nNO2=\nNO2=-4e0\n")
    assert [value for _, value in board.values] == [31.5, 32.25, -4]
    assert board.log[0] == (
        *(b"NO2S", b"NO2,Lat,Lng,Alt", b"fLLf", b"-DUm", b"-GG0"),
        *(31.5, 252_600_000, 515_000_000, 72.5),
    )
    name, labels, types, units, factors, *values = board.log[0]
    assert len(name) <= 4  # what ArduPilot's logger asks of a message
    assert len(labels.split(b",")) == len(types) == len(units) == len(factors) == len(values)
    assert [type(value) for value in values] == [float, int, int, float]  # L takes integers only
    assert not board.texts


def test_without_a_position_a_value_is_sent_but_not_logged():
    board = Board()
    board.place = False
    board.hear(b"\nNO2=5\n")
    assert (board.values, board.log) == ([(b"NO2", 5)], [])


def test_a_silent_sensor_is_said_once_and_again_when_it_is_back():
    board = Board()
    for _ in range(30):
        board.hear(passed_ms=1000)
    assert board.texts == [(4, "NO2: no value from the sensor for 10 s")]
    board.hear(b"\nNO2=5\n")
    assert board.texts[1:] == [(6, "NO2: the sensor is back")]


def test_noise_without_line_ends_does_not_fill_the_memory():
    board = Board()
    for _ in range(100):
        board.hear(b"\x00\xff" * 200)
    board.hear(b"NO2=7\nNO2=8\n")
    assert [value for _, value in board.values] == [8]


def test_a_port_that_is_not_set_up_is_said():
    board = Board(has_port=False)
    assert board.update is None
    assert board.texts == [(4, "NO2: no port has SERIALx_PROTOCOL 28")]
