"""The commands of `gush`, one file each. Heavy libraries load inside them."""
