"""A practice vehicle with logs of short flights on it, served on a UDP port."""

from __future__ import annotations

from contextlib import contextmanager

from practice_rig import ARM, STATION, Peer, Rig, mavlink
from sparsor.link.practice import PracticeServer
from sparsor.link.practice.flavour import Mode

COMPANION = Peer(1, 191, 1)


def logged_rig(autopilot, *, flights=1, seconds=20.0, **settings):
    """A vehicle that stood armed for a while, which is what a log needs."""
    rig = Rig.of(autopilot, truth=lambda *_: 0.5, **settings)
    rig.vehicle.parameters.set("DISARM_DELAY" if autopilot == "ardupilot" else "COM_DISARM_PRFLT", 0.0)
    rig.flight.set_mode(Mode.MANUAL)  # in others PX4 disarms soon
    rig.run(10)
    for _ in range(flights):
        assert rig.command(ARM, 1) == 0, rig.said()
        rig.send(mavlink.MAVLink_named_value_float_message(77, b"NO2C", 3.5), COMPANION)
        rig.run(seconds)
        assert rig.command(ARM, 0) == 0, rig.said()
        rig.run(1)
    return rig


@contextmanager
def served_logs(autopilot, **settings):
    """Yield the server and the bytes of its logs, oldest first."""
    rig = logged_rig(autopilot, **settings)
    vehicle = rig.vehicle
    vehicle.leave(STATION.link)
    vehicle._beat_wall_s = float("-inf")  # the rig's wall clock was the flight's
    with PracticeServer(vehicle, udp=("127.0.0.1", 0)) as server:
        yield server, [log.path.read_bytes() for log in vehicle._log.stored]


def url_of(server):
    return f"udpout://127.0.0.1:{server.udp_port}"
