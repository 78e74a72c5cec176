"""Generated and damaged input, kills and lost workers: what each must come to, and the page about it."""
