"""Elastic bodies move, stiffen and carry loads as finite elements, closed forms and published blades do."""
