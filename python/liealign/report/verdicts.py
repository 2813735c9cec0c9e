"""How each verdict of a fix looks and is called, in figures, keys and counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from liealign.report.style import ALERT, GREY, PALE, VIOLET, WARM


@dataclass(frozen=True)
class Mark:
    """Words and look of one verdict; only ordinary fixes may be thinned out of a figure."""

    words: str
    color: str
    symbol: str
    size: float
    glyph: str  # the symbol as text, for the key under a figure
    ordinary: bool = False

    @property
    def look(self) -> dict[str, Any]:
        """Return the keywords of style.dots."""
        return {"color": self.color, "symbol": self.symbol, "size": self.size}


# In drawing order: what an analyst looks for comes last, on top.
MARKS = {
    "outside_imu": Mark("outside the IMU log", GREY, "cross-thin-open", 6, "+", ordinary=True),
    "averaged_at_rest": Mark("averaged at rest", GREY, "circle-open", 5, "○", ordinary=True),
    "quality_not_accepted": Mark("quality not accepted", GREY, "square-open", 6, "□"),
    "used": Mark("used", PALE, "circle", 4, "●", ordinary=True),
    "weighted": Mark("weighted down", WARM, "triangle-up", 8, "▲"),
    "reacquired": Mark("reacquired", VIOLET, "diamond", 8, "◆"),
    "rejected": Mark("rejected", ALERT, "x", 8, "✕"),
}
