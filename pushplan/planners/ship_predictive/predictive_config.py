"""Parameters of the predictive ship planners."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world.checks import integer, number


@dataclass(frozen=True)
class PredictiveConfig:
    """Parameters of `PredictiveShip` and `PredictiveShipNetwork`. Lengths in hull lengths.

    Args:
        push_weight: w, the cost of a unit of work on the ice against a unit of the ship's own.
        turn_fraction: fraction of the greatest turn rate that plans use; the rest is for tracking.
        arc: length of the pieces that the search puts together.
        curvatures: to each side of straight ahead.
        width: partial paths kept from piece to piece.
        sparse: with fewer floes than this in reach the beam is wider in proportion, up to twice;
            predictions are cheap then.
        widest: with a stop rule the search is repeated with twice the width up to this.
        tries: pieces that are predicted exactly for each path kept; the others are left out by
            their estimate.
        horizon: length of path for which the ice is predicted; from there on the costs to go count.
        farthest: goal lines that are farther away are approached, with a line at this distance.
        margin: least distance of the ship's origin from the sides of the channel, in half beams.
        row: distance between the rows of the table of costs to go.
        column: distance between its columns.
        gain: work of a metre per mass ahead of the bow, in that table.
        crowding: how much more that is for each typical floe there.
    """

    push_weight: float = 1.5
    turn_fraction: float = 0.9
    arc: float = 0.4
    curvatures: int = 2
    width: int = 6
    sparse: int = 150
    widest: int = 48
    tries: float = 2.5
    horizon: float = 5.0
    farthest: float = 40.0
    margin: float = 1.0
    row: float = 0.12
    column: float = 0.1
    gain: float = 1.5
    crowding: float = 1.0

    def __post_init__(self) -> None:
        for name in ("push_weight", "margin", "gain", "crowding"):
            number(name, getattr(self, name), low=0.0)
        for name in ("arc", "row", "column", "horizon", "farthest"):
            number(name, getattr(self, name), low=0.0, open_low=True)
        number("turn_fraction", self.turn_fraction, low=0.0, high=1.0, open_low=True)
        number("tries", self.tries, low=1.0)
        integer("curvatures", self.curvatures, low=1)
        integer("width", self.width, low=1)
        integer("sparse", self.sparse, low=0)
        integer("widest", self.widest, low=self.width)

    def beam_width(self, floes: int) -> int:
        """Paths kept from piece to piece among so many floes in reach."""
        ratio = self.sparse / max(floes, 1)
        return round(self.width * min(max(ratio, 1.0), 2.0))
