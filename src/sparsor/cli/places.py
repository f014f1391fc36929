"""Places that are typed as two words, longitude and latitude, and may be given several times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from typer.core import TyperCommand

if TYPE_CHECKING:
    from collections.abc import Sequence

REPEATED = "--home"


class WithPlaces(TyperCommand):
    """A command with `--home LON LAT`, repeatable: typer repeats options of one word only."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 (typer brings its own Context)
        """Read the command line with the two words of each place as one."""
        ours = any(REPEATED in one.opts and getattr(one, "multiple", False) for one in self.params)
        return super().parse_args(ctx, joined(args) if ours else args)


def joined(args: Sequence[str]) -> list[str]:
    """Return the words with those of each place joined.

    Examples
    --------
    >>> joined(["--home", "51.5", "25.3", "-q"])
    ['--home', '51.5 25.3', '-q']
    """
    left, found = list(args), []
    while left:
        word = left.pop(0)
        found.append(word)
        if word == REPEATED:
            place = [left.pop(0) for _ in range(2) if left and not left[0].startswith("--")]
            found += [" ".join(place)] if place else []
    return found


def homes_given(places: Sequence[str] | None) -> dict[str, Any]:
    """Return the homes as the specification's keys: one, or several.

    Raises
    ------
    MissionError
        When one is not two numbers.
    """
    homes = [_place(words) for words in places or ()]
    if len(homes) > 1:
        return {"homes": homes}
    return {"home": homes[0] if homes else None}


def _place(words: str) -> tuple[float, float]:
    try:
        lon, lat = map(float, words.split())
    except ValueError:
        from sparsor.errors import MissionError

        raise MissionError(f"--home takes two numbers, LON LAT in degrees; given '{words}'") from None
    return lon, lat
