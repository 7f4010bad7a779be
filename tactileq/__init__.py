"""The front door: the command line.

Rooms are top-level packages. So `python -m tactileq` would import `modeling.py` of the working
folder in place of the room; every way into the command line passes here and says so.
"""

from importlib.util import find_spec
from pathlib import Path

ROOMS = ("modeling", "stimuli", "rig", "experiments", "analysis", "benches")


def _in_place_of_rooms() -> list[str]:
    """What Python finds elsewhere than beside this package, under the name of a room."""
    found = {name: find_spec(name) for name in ROOMS}
    places = {
        name: spec.origin or str(next(iter(spec.submodule_search_locations or ["?"])))
        for name, spec in found.items()
        if spec is not None
    }
    own = Path(__file__).resolve().parents[1]
    return [
        place for name, place in places.items() if own / name not in Path(place).resolve().parents
    ]


if _others := _in_place_of_rooms():
    raise SystemExit(
        f"error: expected the packages {', '.join(ROOMS)} of tactileq, got {', '.join(_others)} in "
        "place of one; rename it, or run the program tactileq, or python -P -m tactileq."
    )
