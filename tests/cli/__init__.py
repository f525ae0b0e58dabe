"""The command line prints, writes and refuses what its pages say, with exit codes as a shell sees them."""
