"""`sparsor learn`: from fields to a model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sparsor.cli.console import (
    SCHEDULER,
    Json,
    Quiet,
    Talk,
    Verbose,
    print_json,
    print_table,
    progress_bar,
    reporting,
    warn,
)


@reporting
def learn(
    fields: Annotated[
        list[Path],
        typer.Argument(metavar="FIELD...", help="GeoTIFF, NetCDF, Zarr or heatmap pictures, of any number and size."),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="MODEL.npz", help="The model's file.")],
    window: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--window",
            metavar="EAST_KM NORTH_KM",
            help="Ground size of the maps (default: the smallest the fields resolve).",
            show_default=False,
        ),
    ] = None,
    bbox: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option("--bbox", metavar="W S E N", help="Maps of the size of this box.", show_default=False),
    ] = None,
    variable: Annotated[str | None, typer.Option("--variable", help="NetCDF variable, or GeoTIFF band.")] = None,
    field_time: Annotated[
        str | None, typer.Option("--field-time", help="NetCDF time step: index, beginning of its date, or all.")
    ] = None,
    field_bbox: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option("--field-bbox", metavar="W S E N", help="Where pictures lie.", show_default=False),
    ] = None,
    field_colormap: Annotated[str | None, typer.Option("--field-colormap", help="Colour map of pictures.")] = None,
    field_range: Annotated[
        tuple[float, float] | None,
        typer.Option("--field-range", metavar="LO HI", help="Values of the first and last colour.", show_default=False),
    ] = None,
    atoms: Annotated[int, typer.Option("--atoms", help="Atoms of the dictionary, K.")] = 256,
    dictionary: Annotated[str, typer.Option("--dictionary", help="learned, dct or polynomial.")] = "learned",
    uncentred: Annotated[
        bool, typer.Option("--uncentred", help="Learn without taking off the mean, as the paper does.")
    ] = False,
    seed: Annotated[int, typer.Option("--seed", min=0)] = 0,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", metavar="local|ADDRESS", help=SCHEDULER, show_default=False)
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Learn what maps look like, for 'generate-mission --model'.

    sparsor learn no2.tif -o no2.npz --window 400 400
    """
    from sparsor.core.schedulers import workers_at
    from sparsor.journeys.learning import LearnRequest, learn_from_fields

    talk = Talk.of(quiet=quiet, verbose=verbose)
    request = LearnRequest(
        fields=tuple(fields),
        window_km=window,
        bbox=bbox,
        variable=variable,
        time=field_time,
        field_bbox=field_bbox,
        field_colormap=field_colormap,
        field_range=field_range,
        atoms=atoms,
        dictionary=dictionary,
        centred=not uncentred,
        seed=seed,
    )
    with workers_at(scheduler) as hands, progress_bar(talk) as progress:
        learned = learn_from_fields(request, output, workers=hands, progress=progress)
    model = learned.model
    if as_json:
        print_json(
            {
                "model": str(output),
                "maps": learned.maps,
                "window_m": list(model.window_m),
                "atoms": model.atoms,
                "lasso": model.lasso_weight,
                "validation_relative_error": learned.validation_relative_error,
                "gaps": {"windows_dropped": learned.dropped, "windows_filled": learned.filled},
                "warnings": list(learned.warnings),
            }
        )
        return
    if talk is Talk.QUIET:
        typer.echo(output)
        return
    warn(learned.warnings)
    print_table(
        [
            (
                "maps",
                f"{learned.maps} windows: {model.provenance['training_maps']} training, "
                f"{model.provenance['validation_maps']} validation, the rest between them left out",
            ),
            ("gaps", f"{learned.dropped} windows dropped (more than 5 % missing), {learned.filled} filled"),
            ("window", f"{model.window_m[0] / 1000:.4g} x {model.window_m[1] / 1000:.4g} km"),
            ("scale", f"0..1 = {model.scale[0]:.4g}..{model.scale[1]:.4g} {model.unit}"),
            (
                "dictionary",
                f"{model.provenance['dictionary']}, {model.atoms} atoms, "
                f"{'centred' if model.centred else 'uncentred'}; lambda {model.lasso_weight:g}",
            ),
            ("kernel", model.kernel.words),
            (
                "validation maps",
                f"represented with a relative error of {learned.validation_relative_error:.3f} "
                "(mean of |s - s'| / |s - mean(s)|, every cell known)",
            ),
        ],
        str(output),
    )
