"""How stable time stepping is: critical steps, predicted against exact, and scenes at the edge of what can be asked."""
