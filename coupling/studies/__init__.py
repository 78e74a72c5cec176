"""Studies: many scenes that differ in some parameters, run in parallel, and one dataset of them all."""
