"""Where things go. Each takes what comes without waiting, in a queue with an end."""
