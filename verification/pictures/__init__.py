"""Pictures of the docs, drawn with the program itself."""
