"""Parameters of a scene that are not known, from measurements; and what follows, as surely as they are known then."""
