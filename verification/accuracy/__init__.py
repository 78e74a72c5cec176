"""Error against run time: ladders over problems with known answers, and over a scene without one."""
