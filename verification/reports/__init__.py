"""Report pages of the docs that are no command of `gush`: each module measures the blocks of its page."""
