"""What a vehicle says in words: STATUSTEXT, put together where it came in pieces."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sparsor.link.inbox import Message

PIECE: Final = 50  # characters; a shorter piece is the last one
KEPT: Final = 40
WARNING: Final = 4  # MAV_SEVERITY; lower is worse


@dataclass(frozen=True)
class StatusText:
    """One sentence of the vehicle.

    Parameters
    ----------
    severity : int
        MAV_SEVERITY: 0 emergency to 7 debug.
    text : str
    """

    severity: int
    text: str

    @property
    def serious(self) -> bool:
        """Whether it is a warning or worse."""
        return self.severity <= WARNING


class StatusTexts:
    """Takes STATUSTEXTs as they come and remembers the last ones."""

    def __init__(self) -> None:
        self._said: deque[StatusText] = deque(maxlen=KEPT)
        self._pieces: dict[int, dict[int, str]] = {}

    def take(self, message: Message) -> StatusText | None:
        """Return the sentence that a STATUSTEXT completes; None while pieces are missing."""
        text = str(message.text)
        number = int(getattr(message, "id", 0))  # MAVLink 1 has neither number nor pieces
        if number:
            pieces = self._pieces.setdefault(number, {})
            pieces[int(message.chunk_seq)] = text
            last = max(pieces)
            if len(pieces[last]) == PIECE or len(pieces) != last + 1:
                return None
            text = "".join(pieces[place] for place in sorted(pieces))
            del self._pieces[number]
        said = StatusText(int(message.severity), text)
        self._said.append(said)
        return said

    def last(self, count: int = 3) -> tuple[str, ...]:
        """Return the last sentences, each once; warnings and worse where there are any."""
        serious = [said.text for said in self._said if said.serious]
        texts = serious or [said.text for said in self._said]
        return tuple(dict.fromkeys(reversed(texts)))[:count][::-1]

    def forget(self) -> None:
        """Forget what was said so far."""
        self._said.clear()
