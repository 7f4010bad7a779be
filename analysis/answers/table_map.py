"""What the columns of tables of any experiment mean: `--map`, `--where` and `--right`.

docs/method/tables.md#what-is-read
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from tactileq.modeling import InputError
from tactileq.modeling.errors import shown
from tactileq.modeling.files.others.roles import parse_roles

ROLES = ("participant", "presented", "answered", "correct", "share", "value", "count")
MEASURE_ROLES = ("correct", "share", "value")
# Factors of tables without such a column: which of a participant's files, by order or by name.
OF_FILES = ("session", "file")
# Names of columns of the tables that follow from these.
RESERVED = frozenset(
    {"participant_id", "presented", "answered", "correct", "value", "count", "from_file", "line"}
    | {"condition", "trials", "n", "mean", "ci_low", "ci_high"}
)
EXAMPLE = "correct=TYPE_ANS,factor=TYPE,participant=ID"


@dataclass(frozen=True)
class TableMap:
    """Which column means what; empty where the tables have no such column.

    Without correct, share, value and answered each file is one confusion matrix. Without
    participant the file's name is the participant's.

    Parameters
    ----------
    where : dict of str to tuple of str
        Only rows with one of these values in a column count.
    right : str
        The code in `correct` that means right, or the answer whose share is asked for where nothing
        was presented; empty where none is named.
    decimal : str
        The decimal sign; empty where the tables show it.
    """

    participant: str = ""
    presented: str = ""
    answered: str = ""
    correct: str = ""
    share: str = ""
    value: str = ""
    count: str = ""
    factors: tuple[str, ...] = ()
    where: dict[str, tuple[str, ...]] = field(default_factory=dict)
    right: str = ""
    decimal: str = ""

    @property
    def is_matrix(self) -> bool:
        """Whether the files are matrices."""
        return not any((self.answered, self.correct, self.share, self.value))

    @property
    def columns(self) -> dict[str, str]:
        """Role to column, of those that were named."""
        return {role: getattr(self, role) for role in ROLES if getattr(self, role)}

    @property
    def wanted(self) -> tuple[str, ...]:
        """All columns that a table has to have."""
        factors = (name for name in self.factors if name not in OF_FILES)
        return (*self.columns.values(), *factors, *self.where)


def parse_map(
    texts: str | Sequence[str], *, where: Sequence[tuple[str, str]] = (), right: str = ""
) -> TableMap:
    """The map as the command line has it: `correct=TYPE_ANS,factor=TYPE,factor=SIZE`, or a file.

    Raises
    ------
    InputError
        For other words than the roles, one of them twice, or roles that do not go together.
    """
    found = parse_roles(
        [texts] if isinstance(texts, str) else texts,
        roles=(*ROLES, "factor"),
        several=("factor",),
        where=where,
        right=right,
        example=EXAMPLE,
    )
    columns = dict(found.columns)
    factors = tuple(columns.pop("factor", ()))
    mapping = TableMap(
        **{role: names[0] for role, names in columns.items()},
        factors=factors,
        where=found.where,
        right=found.right,
        decimal=found.decimal,
    )
    _check_map(mapping)
    return mapping


def _check_map(mapping: TableMap) -> None:
    measures = [role for role in MEASURE_ROLES if getattr(mapping, role)]
    if len(measures) > 1:
        raise InputError(
            f"expected one measure in the map, got {' and '.join(measures)}; analyse one at a time."
        )
    if mapping.presented and not mapping.answered:
        raise InputError(
            "expected presented and answered together in the map, got only one of them; "
            "name the other column, too."
        )
    if mapping.is_matrix and (mapping.participant or mapping.count or mapping.where):
        raise InputError(
            "expected correct, share, value, or presented and answered in the map, got none of "
            f"them; write it like {EXAMPLE}."
        )
    taken = [*mapping.columns.values(), *mapping.factors]
    for column in taken:
        if taken.count(column) > 1:
            raise InputError(
                f"expected each column once in the map, got {shown(column)} for two roles; "
                f"write it like {EXAMPLE}."
            )
    if mapping.right and not (mapping.correct or mapping.answered):
        raise InputError(
            "expected correct or answered in the map for the code of --right, got neither; name "
            "the column that holds it, or leave --right out."
        )
    if mapping.right and mapping.presented:
        raise InputError(
            "expected presented and answered, or --right, got both; leave --right out: an answer "
            "is right where it is what was presented."
        )
    for factor in mapping.factors:
        if factor in RESERVED:
            raise InputError(
                f"expected factors of other names than {', '.join(sorted(RESERVED))}, got "
                f"{factor}; rename that column."
            )
