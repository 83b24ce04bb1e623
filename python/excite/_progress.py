"""Progress of long calls: a bar of ``tqdm`` where it is installed and somebody looks."""

from __future__ import annotations

import sys
from typing import Any, Callable, Optional, Union

Report = Callable[[float, float, str], None]
#: ``None``: a bar where somebody looks; ``True``: a bar; ``False``: none; or a function of what is done, of how much,
#: and of words.
Progress = Union[None, bool, Report]


class Bar:
    """A bar for one call."""

    def __init__(self, progress: Progress, name: str) -> None:
        self._bar: Any = None
        self._function: Optional[Report] = None
        if callable(progress):
            self._function = progress
        elif progress or (progress is None and _watched()):
            self._bar = _tqdm(name, progress is True)

    @property
    def report(self) -> Optional[Report]:
        """What the library calls; nothing where nobody listens."""
        if self._function is not None:
            return self._function
        return self._show if self._bar is not None else None

    def _show(self, done: float, of: float, text: str) -> None:
        if of > 0:
            self._bar.total = of
            self._bar.n = done
        self._bar.set_postfix_str(text, refresh=True)

    def __enter__(self) -> "Bar":
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()


def _watched() -> bool:
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


def _tqdm(name: str, wanted: bool) -> Any:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        if wanted:
            from ._errors import unusable

            raise unusable("progress=True needs tqdm: pip install tqdm") from None
        return None
    return tqdm(desc=name, leave=False, bar_format="{desc} {bar} {elapsed} {postfix}")
