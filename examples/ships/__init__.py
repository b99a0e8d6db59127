"""Ships by published equations, independent of those of shiplog, and sea trials with them."""
