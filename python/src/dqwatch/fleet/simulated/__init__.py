"""A simulated fleet: logs whose truth is known, to judge the comparison by and to show it."""
