"""A progress bar on stderr for whatever takes more than a second, when stderr is a terminal."""

from __future__ import annotations

import sys
import threading
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

SHOW_AFTER_S = 1.0


class ProgressBar:
    """A context: the bar appears after a second and vanishes at the end. Call it with (done, total)."""

    def __init__(self, text: str, *, quiet: bool) -> None:
        self._bar: Progress | None = None
        if quiet or not sys.stderr.isatty():
            return
        columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
        self._bar = Progress(*columns, console=Console(stderr=True), transient=True)
        self._task = self._bar.add_task(text, total=None)
        # The engine works without the interpreter lock, so the timer fires during its first batch too.
        self._timer = threading.Timer(SHOW_AFTER_S, self._bar.start)
        self._timer.daemon = True

    def __call__(self, done: int, total: int) -> None:
        """Show how far the work is."""
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=total)

    def __enter__(self) -> Self:
        """Start the clock."""
        if self._bar is not None:
            self._timer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._timer.cancel()
            self._timer.join()
            self._bar.stop()
