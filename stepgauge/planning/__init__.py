"""From a placement to the checked text of a measuring program."""
