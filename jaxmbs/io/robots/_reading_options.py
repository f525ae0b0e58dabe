"""Options that readers of robot files have in common, checked before a file is opened."""

#: What each option may be; the first is the default of most readers.
_CHOICES: dict[str, tuple[str, ...]] = {
    **dict(base=("fixed", "free"), fixed=("frames", "welds"), inertias=("refuse", "repair", "accept")),
    **dict(friction=("smooth", "ignore"), tendons=("read", "drop", "refuse"), armature=("rotors", "drop")),
}


def require_choices(**given: str) -> None:
    """Raises: ValueError for an option of another value."""
    for what, value in given.items():
        if value not in _CHOICES[what]:
            raise ValueError(f"{what} = {value!r}: one of {', '.join(map(repr, _CHOICES[what]))}")
