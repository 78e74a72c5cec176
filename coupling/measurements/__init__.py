"""What was measured in the field or in a model test, and how far a run is from it.

Page: docs/how-to/measurements.md.
"""

from coupling.measurements.misfit import misfit
from coupling.measurements.quantities import QUANTITIES
from coupling.measurements.read import read_measurements
from coupling.measurements.taken import at_measurements

__all__ = ["QUANTITIES", "at_measurements", "misfit", "read_measurements"]
