"""How statements are put into words: numbers, headlines, limits, and what a cause means at the machine."""
