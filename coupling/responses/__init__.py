"""The answers of rings to the pressures on their tunnels: computed, stored, held against limits, compared."""
