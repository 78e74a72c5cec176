"""The shape of a ring that deforms, apart from its motion as a whole."""

import numpy as np
from numpy.typing import NDArray


def centred(
    angle: NDArray[np.float64], radial: NDArray[np.float64], tangential: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radial and tangential displacement (.., n) without the mean displacement of the ring, two of (.., n) float64."""
    horizontal = np.mean(radial * np.sin(angle) + tangential * np.cos(angle), axis=-1, keepdims=True)
    vertical = np.mean(radial * np.cos(angle) - tangential * np.sin(angle), axis=-1, keepdims=True)
    return (
        radial - horizontal * np.sin(angle) - vertical * np.cos(angle),
        tangential - horizontal * np.cos(angle) + vertical * np.sin(angle),
    )
