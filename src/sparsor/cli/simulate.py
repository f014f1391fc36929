"""`sparsor simulate`: the practice autopilot, with a sensor flying through a field."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

import typer

from sparsor.cli.console import Quiet, Verbose, reporting
from sparsor.errors import InputError

if TYPE_CHECKING:
    from sparsor.link.practice import PracticeServer, PracticeSettings

LISTENING = "Where it listens"
VEHICLE = "What it is"
SENSOR = "The sensor on it"
DEFAULT_LISTEN = ("udp:14550", "tcp:5760")
_ADDRESS = re.compile(r"(?P<kind>udp|udpin|tcp|tcpin)(?:://|:)(?:(?P<host>[^:/]*):)?(?P<port>\d{1,5})")


@reporting
def simulate(
    home: Annotated[
        tuple[float, float],
        typer.Option("--home", help="Where it stands.", metavar="LON LAT", rich_help_panel=VEHICLE),
    ],
    home_altitude: Annotated[
        float,
        typer.Option(
            "--home-altitude", help="Height of home above mean sea level, m.", metavar="M", rich_help_panel=VEHICLE
        ),
    ] = 0.0,
    autopilot: Annotated[
        str, typer.Option("--autopilot", help="ardupilot or px4.", metavar="NAME", rich_help_panel=VEHICLE)
    ] = "ardupilot",
    vehicle: Annotated[
        str, typer.Option("--vehicle", help="quad, or a profile.", metavar="NAME|FILE.toml", rich_help_panel=VEHICLE)
    ] = "quad",
    system: Annotated[
        int, typer.Option("--system", help="MAVLink system id.", metavar="ID", rich_help_panel=VEHICLE)
    ] = 1,
    listen: Annotated[
        list[str] | None,
        typer.Option(
            "--listen",
            help="udp:PORT, tcp:PORT or udp:HOST:PORT; one of each (default: udp:14550 and tcp:5760).",
            metavar="ADDRESS",
            rich_help_panel=LISTENING,
        ),
    ] = None,
    speedup: Annotated[
        float,
        typer.Option("--speedup", help="Simulated seconds a second.", metavar="N", rich_help_panel=LISTENING),
    ] = 1.0,
    sensor: Annotated[
        bool,
        typer.Option("--sensor/--no-sensor", help="Whether a sensor flies on it.", rich_help_panel=SENSOR),
    ] = True,
    sensor_range: Annotated[
        tuple[float, float],
        typer.Option(
            "--sensor-range",
            help="Reading at the field's lowest and highest value, ppb.",
            metavar="LO HI",
            rich_help_panel=SENSOR,
        ),
    ] = (10.0, 70.0),
    t90: Annotated[
        float, typer.Option("--t90", help="Time to 90 % of a step, s.", metavar="S", rich_help_panel=SENSOR)
    ] = 30.0,
    noise: Annotated[
        float, typer.Option("--noise", help="Of each sample, ppb.", metavar="PPB", rich_help_panel=SENSOR)
    ] = 1.0,
    drift: Annotated[
        float, typer.Option("--drift", help="After an hour, ppb.", metavar="PPB", rich_help_panel=SENSOR)
    ] = 0.0,
    drop_outs: Annotated[
        float,
        typer.Option("--drop-outs", help="Share of samples lost, 0..1.", metavar="SHARE", rich_help_panel=SENSOR),
    ] = 0.0,
    seed: Annotated[
        int, typer.Option("--seed", help="Of noise and drop-outs.", metavar="N", rich_help_panel=SENSOR)
    ] = 0,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Stand in for a vehicle, so that a mission can be rehearsed; not flight dynamics. Ctrl-C ends it.

    sparsor simulate --home 51.51 25.28 --speedup 10
    """
    del verbose
    from sparsor.link.practice import PracticeAutopilot, PracticeServer, SensorSettings

    addresses = _addresses(listen or list(DEFAULT_LISTEN))
    settings = _settings(
        home=(*home, home_altitude),
        autopilot=autopilot,
        vehicle=vehicle,
        system=system,
        seed=seed,
        sensor=SensorSettings(
            low_ppb=sensor_range[0],
            high_ppb=sensor_range[1],
            t90_s=t90,
            noise_ppb=noise,
            drift_ppb_h=drift,
            drop_out_fraction=drop_outs,
        )
        if sensor
        else None,
    )
    server = PracticeServer(
        PracticeAutopilot(settings), udp=addresses.get("udp"), tcp=addresses.get("tcp"), speedup=speedup
    )
    if not quiet:
        _introduce(server, addresses)
    _serve(server)


def _addresses(texts: list[str]) -> dict[str, tuple[str, int]]:
    """Return host and port for each of udp and tcp that is asked for."""
    found: dict[str, tuple[str, int]] = {}
    for text in texts:
        match = _ADDRESS.fullmatch(text)
        if not match or int(match["port"]) > 65_535:
            raise InputError(f"--listen {text}: give udp:PORT, tcp:PORT or udp:HOST:PORT, e.g. udp:14550")
        kind = match["kind"].removesuffix("in")
        if kind in found:
            raise InputError(f"--listen {text}: one {kind} port is enough for any number of clients")
        found[kind] = (match["host"] or "127.0.0.1", int(match["port"]))
    return found


def _settings(
    *,
    home: tuple[float, float, float],
    autopilot: str,
    vehicle: str,
    system: int,
    seed: int,
    sensor: object,
) -> PracticeSettings:
    import time

    from sparsor.link.practice import PracticeSettings, SensorSettings, built_in_truth, flavour_named
    from sparsor.mission import Home
    from sparsor.vehicle import load_vehicle

    lon, lat, altitude = home
    return PracticeSettings(
        home=Home(lon, lat, altitude, altitude_known=altitude != 0),
        flavour=flavour_named(autopilot),
        vehicle=load_vehicle(vehicle),
        sensor=sensor if isinstance(sensor, SensorSettings) else SensorSettings(),
        truth=built_in_truth(lon, lat) if sensor else None,
        seed=seed,
        system=system,
        boot_unix_s=time.time(),
    )


def _introduce(server: PracticeServer, addresses: dict[str, tuple[str, int]]) -> None:
    settings = server.autopilot.settings
    place = f"{settings.home.lon_deg:g} {settings.home.lat_deg:g}"
    typer.echo(f"{settings.flavour.title} at {place}, for rehearsals; not flight dynamics")
    if server.udp_port:
        typer.echo(f"connect to udpout://{addresses['udp'][0]}:{server.udp_port}")
    if server.tcp_port:
        typer.echo(f"connect to tcpout://{addresses['tcp'][0]}:{server.tcp_port}")


def _serve(server: PracticeServer) -> None:
    import signal
    import sys

    def stop(*_: object) -> None:
        server.stop()

    sys.stdout.flush()
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        server.run()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        server.close()
