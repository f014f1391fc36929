-- Reads a gas sensor on a serial port of the autopilot, sends its value as NAMED_VALUE_FLOAT and writes it with
-- the vehicle's position into the dataflash log (.BIN) as message NO2S. For ArduPilot 4.5 and later.
--
-- Copy it to APM/scripts on the SD card and set (x: the port the sensor is on), then reboot:
--   SCR_ENABLE 1, SERIALx_PROTOCOL 28 (Scripting), SERIALx_BAUD as below

local BAUD = 9600
local PATTERN = "NO2=([-+.%deE]+)" -- a Lua pattern; what is in brackets is the value. A bare number: "^%s*([-+.%deE]+)"
local NAME = "NO2" -- in the telemetry, at most 10 characters
local LOWEST, HIGHEST = -1000, 100000 -- what lies outside is a fault of the sensor, not a value
local INTERVAL_MS = 100 -- between looks at the port
local SILENT_MS = 10000
local LONGEST = 512 -- bytes kept of a line without an end

local WARNING, INFO = 4, 6 -- MAV_SEVERITY

local port = serial:find_serial(0)
if not port then
  gcs:send_text(WARNING, NAME .. ": no port has SERIALx_PROTOCOL 28")
  return
end
port:begin(BAUD)
port:set_flow_control(0)

local buffer = ""
local in_step = false -- the first line may have begun before we listened: half a number is a wrong number
local heard_ms = millis():toint()
local silent = false

local function value_of(line)
  local value = tonumber(line:match(PATTERN) or "")
  if value and value >= LOWEST and value <= HIGHEST then -- false for NaN
    return value
  end
  return nil
end

local function report(value)
  gcs:send_named_float(NAME, value)
  local place = ahrs:get_location()
  if place then
    -- L is a latitude or longitude in 1e-7 degrees; altitude above mean sea level in metres.
    logger:write("NO2S", "NO2,Lat,Lng,Alt", "fLLf", "-DUm", "-GG0", value, place:lat(), place:lng(), place:alt() * 0.01)
  end
end

local function take(line)
  local value = value_of(line)
  if not value then
    return
  end
  if silent then
    gcs:send_text(INFO, NAME .. ": the sensor is back")
  end
  heard_ms, silent = millis():toint(), false
  report(value)
end

local function update()
  local waiting = port:available():toint()
  if waiting > 0 then
    buffer = buffer .. (port:readstring(math.min(waiting, LONGEST)) or "")
  end
  while true do
    local ending = buffer:find("[\r\n]")
    if not ending then
      break
    end
    if in_step then
      take(buffer:sub(1, ending - 1))
    end
    in_step = true
    buffer = buffer:sub(ending + 1)
  end
  if #buffer > LONGEST then
    buffer, in_step = "", false
  end
  if not silent and millis():toint() - heard_ms > SILENT_MS then
    silent = true
    gcs:send_text(WARNING, NAME .. ": no value from the sensor for 10 s")
  end
  return update, INTERVAL_MS
end

return update, INTERVAL_MS
