"""`FrictionEstimator`: the friction of the bumper, from how the box slides on it."""

from __future__ import annotations

import numpy as np

from pushplan.planners.pushing.contact_kernels import Contact
from pushplan.planners.pushing.push_observer import PushObserver
from pushplan.world.checks import FloatArray

_FRICTIONS = np.array([0.0, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8])
_MEMORY = 0.95  # fraction of the errors so far that counts after another observation
_TELLING = 1e-3  # difference of predicted offsets below which an observation says nothing [L]
_PRIOR = 0.001
"""Square of an error of prediction [L²] that speaks as much as a friction that is off by 1."""


class FrictionEstimator:
    """Compares predictions of the contact model with several frictions to what is observed.

    A bank of models: each predicts the box's offset on the bumper from one observation to the
    next, and the one whose squared errors are least, with the older ones forgotten, is believed.
    While the box sticks all predict the same, and the friction that was assumed stands.

    Args:
        assumed: friction at the beginning.
    """

    def __init__(self, assumed: float) -> None:
        self._frictions = np.append(_FRICTIONS, assumed)
        self._prior = _PRIOR * (self._frictions - assumed) ** 2
        self._errors = np.zeros(len(self._frictions))
        self.friction = assumed

    def update(
        self, observer: PushObserver, contact: Contact, seen: FloatArray, time: float, size: float
    ) -> None:
        """Take an observation.

        Args:
            observer: which knows the state before and the commands since.
            contact: bumper and face.
            seen: (6,) observed state, see `PushState.row`.
            time: of the observation [s].
            size: L [m].
        """
        offsets = np.empty(len(self._frictions))
        for j, friction in enumerate(self._frictions.tolist()):
            state = observer.predict(contact._replace(friction=friction), time)
            if state is None or state[5] > 0.0:  # the box does not touch the bumper
                return
            offsets[j] = state[3]
        if np.ptp(offsets) < _TELLING * size:
            return
        self._errors = _MEMORY * self._errors + ((seen[3] - offsets) / size) ** 2
        self.friction = float(self._frictions[np.argmin(self._errors + self._prior)])
