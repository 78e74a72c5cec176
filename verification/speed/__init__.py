"""What a point-step, a start and a study cost, beside a plain loop and a copy of memory on the same machine."""
