"""A generalized travelling salesman instance as files hold it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pushplan.errors import InvalidInputError
from pushplan.gtsp.checking import checked_clusters, checked_costs
from pushplan.gtsp.distances import COORDINATE_TYPES, Distances, distances
from pushplan.world.checks import ArrayRecord, FloatArray, array, choice, frozen


@dataclass(frozen=True, eq=False)
class GtspInstance(ArrayRecord):
    """Costs between nodes and a partition of the nodes.

    Args:
        name: what it is called; one line.
        costs: (N, N) cost of each arc; an infinite one is forbidden, the diagonal is not used.
            They are made from coordinates when they are first read if None.
        clusters: the nodes of each cluster, from 0.
        weight_type: ``"EXPLICIT"``, or the TSPLIB rule that gives the costs from coordinates.
        coordinates: (N, 2) for such a rule, else None.
        comment: one line.
    """

    name: str
    costs: FloatArray
    clusters: tuple[tuple[int, ...], ...]
    weight_type: str = "EXPLICIT"
    coordinates: FloatArray | None = None
    comment: str = ""

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("name", "comment"):
            text = getattr(self, name)
            if not isinstance(text, str) or len(text.splitlines()) > 1:
                raise InvalidInputError(f"instance {name} must be one line of text, got {text!r}")
        choice("weight type", self.weight_type, ("EXPLICIT", *COORDINATE_TYPES))
        if (self.coordinates is None) != (self.weight_type == "EXPLICIT"):
            raise InvalidInputError(
                f"weight type {self.weight_type} goes "
                f"{'without' if self.weight_type == 'EXPLICIT' else 'with'} coordinates"
            )
        if self.coordinates is not None:
            put(self, "coordinates", array("coordinates", self.coordinates, (None, 2)))
        if self.costs is None and self.coordinates is not None:
            del self.__dict__["costs"]
            if not Distances(self.coordinates, self.weight_type).all_finite:
                checked_costs(self.costs)
        else:
            put(self, "costs", frozen(np.array(checked_costs(self.costs), dtype=np.float64)))
        count = len(self.table)
        if self.coordinates is not None:
            array("coordinates", self.coordinates, (count, 2))
        members = checked_clusters(self.clusters, count)
        put(self, "clusters", tuple(tuple(int(v) for v in nodes) for nodes in members))

    def __getattr__(self, name: str) -> Any:
        """Make the costs, where they follow from coordinates, when they are first read."""
        at = self.__dict__.get("coordinates")
        if name != "costs" or at is None:
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        costs = frozen(distances(at, self.weight_type))
        object.__setattr__(self, "costs", costs)
        return costs

    @property
    def table(self) -> FloatArray | Distances:
        """The costs, or what makes those of them that are asked for."""
        if "costs" in self.__dict__ or self.coordinates is None:
            return self.costs
        return Distances(self.coordinates, self.weight_type)

    @staticmethod
    def from_coordinates(
        name: str,
        coordinates: ArrayLike,
        clusters: Sequence[Sequence[int] | NDArray[np.int64]],
        weight_type: str = "EUC_2D",
        comment: str = "",
    ) -> GtspInstance:
        """An instance whose costs follow from coordinates by a rule of TSPLIB.

        Args:
            name: what it is called.
            coordinates: (N, 2).
            clusters: the nodes of each cluster, from 0.
            weight_type: one of `COORDINATE_TYPES`.
            comment: one line.
        """
        at = array("coordinates", coordinates, (None, 2))
        listed = tuple(tuple(nodes) for nodes in clusters)
        none: Any = None
        return GtspInstance(name, none, listed, weight_type, at, comment)
