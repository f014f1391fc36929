"""`sparsor simulate`: the practice autopilot, with a sensor flying through a field."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sparsor.cli.console import Verbose, ended_by_signals, quiet_option, reporting, warn
from sparsor.errors import InputError

if TYPE_CHECKING:
    from sparsor.link.practice import PracticeServer, Window

VEHICLE, LISTENING = "What it is", "Where it listens, and how fast time runs"
SENSOR, FIELD, WIND = "The sensor on it", "The field that the sensor flies through", "The wind"
TROUBLES = "What goes wrong (windows FROM:TO in simulated seconds since take-off)"
DEFAULT_LISTEN = ("udp:14550", "tcp:5760")
Box = tuple[float, float, float, float]
SocketAddress = tuple[str, int]
_ADDRESS = re.compile(r"(?P<kind>udp|udpin|tcp|tcpin)(?:://|:)(?:(?P<host>[^:/]*):)?(?P<port>\d{1,5})")
_TARGET = re.compile(r"(?:udp|udpout)(?:://|:)(?P<host>[^:/]+):(?P<port>\d{1,5})")
MOST_PORT = 65_535


def _option(panel: str, help_text: str, *names: str, metavar: str | None = None) -> Any:  # noqa: ANN401
    return typer.Option(*names, help=help_text, rich_help_panel=panel, metavar=metavar)


@reporting
def simulate(
    mission: Annotated[
        Path | None,
        _option(
            VEHICLE,
            "Rehearse this mission, or this plan of it: home, autopilot, vehicle, sensor and box.",
            "--mission",
            metavar="DIR|FILE.plan",
        ),
    ] = None,
    home: Annotated[
        tuple[float, float] | None,
        _option(
            VEHICLE,
            "Where it stands (default: home of the plan, or of the first).",
            "--home",
            metavar="LON LAT",
        ),
    ] = None,
    home_altitude: Annotated[
        float | None,
        _option(VEHICLE, "Height of home above mean sea level, m.", "--home-altitude", metavar="M"),
    ] = None,
    autopilot: Annotated[
        str | None,
        _option(VEHICLE, "ardupilot or px4 (default: the mission's, else ardupilot).", "--autopilot", metavar="NAME"),
    ] = None,
    vehicle: Annotated[
        str | None,
        _option(
            VEHICLE, "quad, or a profile (default: the mission's, else quad).", "--vehicle", metavar="NAME|FILE.toml"
        ),
    ] = None,
    system: Annotated[int, _option(VEHICLE, "MAVLink system id.", "--system", metavar="ID")] = 1,
    logs: Annotated[
        Path | None,
        _option(
            VEHICLE,
            "Where the vehicle's own logs go (.BIN or .ulg, one a flight); without it they go with the program.",
            "--logs",
            metavar="DIR",
        ),
    ] = None,
    listen: Annotated[
        list[str] | None,
        _option(
            LISTENING,
            "udp:PORT, tcp:PORT, udp:HOST:PORT or udpin://HOST:PORT; one of each (default: udp:14550 and tcp:5760, "
            "with --send-to the latter).",
            "--listen",
            metavar="ADDRESS",
        ),
    ] = None,
    send_to: Annotated[
        list[str] | None,
        _option(
            LISTENING,
            "Send from the start to who waits at udp:HOST:PORT, e.g. udp:127.0.0.1:14540 for udpin://0.0.0.0:14540; "
            "may be repeated.",
            "--send-to",
            metavar="ADDRESS",
        ),
    ] = None,
    speedup: Annotated[float, _option(LISTENING, "Simulated seconds a second.", "--speedup", metavar="N")] = 1.0,
    seed: Annotated[int, _option(LISTENING, "Of noise, drop-outs, gusts and bad links.", "--seed", metavar="N")] = 0,
    sensor: Annotated[bool, _option(SENSOR, "Whether a sensor flies on it.", "--sensor/--no-sensor")] = True,
    sensor_range: Annotated[
        tuple[float, float],
        _option(SENSOR, "Reading at the field's lowest and highest value, ppb.", "--sensor-range", metavar="LO HI"),
    ] = (10.0, 70.0),
    t90: Annotated[
        float | None,
        _option(SENSOR, "Time to 90 % of a step, s (default: the mission's sensor's, else 30).", "--t90", metavar="S"),
    ] = None,
    noise: Annotated[
        float | None,
        _option(SENSOR, "Of each sample, ppb (default: the mission's sensor's, else 1).", "--noise", metavar="PPB"),
    ] = None,
    drift: Annotated[float, _option(SENSOR, "After an hour, ppb.", "--drift", metavar="PPB")] = 0.0,
    drop_outs: Annotated[float, _option(SENSOR, "Share of samples lost, 0..1.", "--drop-outs", metavar="SHARE")] = 0.0,
    field: Annotated[
        Path | None,
        _option(
            FIELD,
            "GeoTIFF, NetCDF or a heatmap picture (default: the built-in synthetic field).",
            "--field",
            metavar="FILE",
        ),
    ] = None,
    variable: Annotated[
        str | None, _option(FIELD, "NetCDF variable, or GeoTIFF band.", "--variable", metavar="V")
    ] = None,
    field_time: Annotated[
        str | None,
        _option(FIELD, "NetCDF time step: its index or the beginning of its date.", "--field-time", metavar="T"),
    ] = None,
    field_bbox: Annotated[
        Box | None, _option(FIELD, "Where a picture lies.", "--field-bbox", metavar="W S E N")
    ] = None,
    field_colormap: Annotated[
        str | None,
        _option(FIELD, "Colour map a picture was drawn with, e.g. viridis.", "--field-colormap", metavar="NAME"),
    ] = None,
    field_range: Annotated[
        tuple[float, float] | None,
        _option(FIELD, "Values of a picture's first and last colour.", "--field-range", metavar="LO HI"),
    ] = None,
    field_over: Annotated[
        Box | None,
        _option(
            FIELD,
            "Lay the field over this box, as a pattern (default: over the mission's box, else where it lies).",
            "--field-over",
            metavar="W S E N",
        ),
    ] = None,
    truth: Annotated[
        Path | None,
        _option(FIELD, "Write the field it flies through, in ppb, to this NetCDF file.", "--truth", metavar="FILE.nc"),
    ] = None,
    force: Annotated[bool, _option(FIELD, "Replace that file when it is there.", "--force")] = False,
    wind: Annotated[
        tuple[float, float],
        _option(WIND, "Speed, m/s, and where it comes from, degrees (90: east).", "--wind", metavar="SPEED FROM_DEG"),
    ] = (0.0, 0.0),
    gusts: Annotated[
        float, _option(WIND, "Standard deviation of gusts on top of it, m/s.", "--gusts", metavar="M_S")
    ] = 0.0,
    lose: Annotated[
        float, _option(TROUBLES, "Share of the messages lost, each way, all the time.", "--lose", metavar="SHARE")
    ] = 0.0,
    repeat: Annotated[
        float, _option(TROUBLES, "Share of the messages that come twice.", "--repeat", metavar="SHARE")
    ] = 0.0,
    delay: Annotated[
        float, _option(TROUBLES, "How long messages take, each way, s by the wall clock.", "--delay", metavar="S")
    ] = 0.0,
    silent_sensor: Annotated[
        list[str] | None, _option(TROUBLES, "The sensor sends nothing.", "--silent-sensor", metavar="FROM:TO")
    ] = None,
    gps_outage: Annotated[
        list[str] | None, _option(TROUBLES, "The GPS has no fix.", "--gps-outage", metavar="FROM:TO")
    ] = None,
    link_loss: Annotated[
        list[str] | None, _option(TROUBLES, "Nothing gets in or out.", "--link-loss", metavar="FROM:TO")
    ] = None,
    low_battery: Annotated[
        float | None,
        _option(TROUBLES, "When the battery falls to what makes it return.", "--low-battery", metavar="S"),
    ] = None,
    keep_battery: Annotated[
        bool, _option(TROUBLES, "Nobody changes the battery between flights.", "--keep-battery")
    ] = False,
    quiet: Annotated[bool, quiet_option("Print warnings and errors only.")] = False,
    verbose: Verbose = False,
) -> None:
    """Stand in for a vehicle, so that a mission can be rehearsed; not flight dynamics. Ctrl-C ends it.

    sparsor simulate --mission missions/doha --speedup 10
    """
    del verbose
    from sparsor.journeys.practising import FieldRequest, PracticeRequest, prepare_practice, write_truth
    from sparsor.link.practice import (
        LinkTroubles,
        PracticeAutopilot,
        PracticeServer,
        SensorSettings,
        Troubles,
        WindSettings,
    )

    if truth is not None and truth.exists() and not force:
        raise InputError(f"'{truth}' is there already; give another name, or --force to replace it")
    addresses = _addresses(listen or list(DEFAULT_LISTEN[1:] if send_to else DEFAULT_LISTEN))
    targets = [_target(text) for text in send_to or ()]
    practice = prepare_practice(
        PracticeRequest(
            mission=mission,
            home=home,
            home_altitude_m=home_altitude,
            autopilot=autopilot,
            vehicle=vehicle,
            through=FieldRequest(field, variable, field_time, field_bbox, field_colormap, field_range, over=field_over),
            sensor=SensorSettings(
                low_ppb=sensor_range[0],
                high_ppb=sensor_range[1],
                drift_ppb_h=drift,
                drop_out_fraction=drop_outs,
            )
            if sensor
            else None,
            t90_s=t90,
            noise_ppb=noise,
            wind=WindSettings(*wind, gusts),
            troubles=Troubles(
                silent_sensor=_windows("--silent-sensor", silent_sensor),
                gps_outage=_windows("--gps-outage", gps_outage),
                link_loss=_windows("--link-loss", link_loss),
                low_battery_s=low_battery,
                link=LinkTroubles(lose, repeat, delay),
                keep_battery=keep_battery,
            ),
            seed=seed,
            system=system,
            logs=logs,
        )
    )
    warn(practice.notes)
    if truth is not None:
        write_truth(practice, truth)
    server = PracticeServer(
        PracticeAutopilot(practice.settings, (lambda _: None) if quiet else _tell),
        udp=addresses.get("udp"),
        tcp=addresses.get("tcp"),
        send_to=targets,
        speedup=speedup,
    )
    try:
        with ended_by_signals(server.stop):  # from before it says where it listens
            if not quiet:
                _introduce(server, addresses, targets, truth, mission)
            server.run()
    finally:
        server.close()


def _tell(line: str) -> None:
    typer.echo(line, err=True)


def _addresses(texts: list[str]) -> dict[str, SocketAddress]:
    """Return host and port for each of udp and tcp that is asked for."""
    found: dict[str, SocketAddress] = {}
    for text in texts:
        match = _ADDRESS.fullmatch(text)
        if not match or int(match["port"]) > MOST_PORT:
            raise InputError(f"--listen {text}: give udp:PORT, tcp:PORT or udp:HOST:PORT, e.g. udp:14550")
        kind = match["kind"].removesuffix("in")
        if kind in found:
            raise InputError(f"--listen {text}: one {kind} port is enough for any number of clients")
        found[kind] = (match["host"] or "127.0.0.1", int(match["port"]))
    return found


def _target(text: str) -> SocketAddress:
    """Return host and port to send to."""
    match = _TARGET.fullmatch(text)
    if not match or not 0 < int(match["port"]) <= MOST_PORT:
        raise InputError(f"--send-to {text}: give udp:HOST:PORT, e.g. udp:127.0.0.1:14540")
    return match["host"], int(match["port"])


def _windows(option: str, texts: list[str] | None) -> tuple[Window, ...]:
    from sparsor.link.practice import Window

    try:
        return tuple(Window.parse(text) for text in texts or ())
    except InputError as error:
        raise InputError(f"{option}: {error}") from error


def _introduce(
    server: PracticeServer,
    addresses: dict[str, SocketAddress],
    targets: list[SocketAddress],
    truth: Path | None,
    mission: Path | None,
) -> None:
    settings = server.autopilot.settings
    place = f"{settings.home.lon_deg:g} {settings.home.lat_deg:g}"
    typer.echo(f"{settings.flavour.title} at {place}, for rehearsals; not flight dynamics")
    urls = [
        f"{kind}out://{_reachable(addresses[kind][0])}:{port}"
        for kind, port in (("udp", server.udp_port), ("tcp", server.tcp_port))
        if port
    ]
    for url in urls:
        typer.echo(f"connect to {url}")
    for host, port in targets:
        typer.echo(f"sends to {host}:{port}; connect there to udpin://0.0.0.0:{port}")
    if truth is not None:
        typer.echo(f"the field it flies through is in {truth}")
    if settings.truth is not None:
        typer.echo(f"its sensor: t90 {settings.sensor.t90_s:g} s, noise {settings.sensor.noise_ppb:g} ppb")
    if mission is not None and urls:
        typer.echo(f"to fly the mission: sparsor fly {mission} --connect {urls[0]}")


def _reachable(host: str) -> str:
    """Return where to connect to what listens at a host: 0.0.0.0 is every address of this computer."""
    return "127.0.0.1" if host in ("", "0.0.0.0") else host
