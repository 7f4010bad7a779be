"""What a force device renders under the virtual surfaces: [wall] of a study file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from tactileq.modeling import InputError
from tactileq.modeling.checks import check_keys
from tactileq.modeling.files.described import FileSection, key
from tactileq.modeling.files.kinds import Label, is_different
from tactileq.rig.machines.force.wall import LARGEST_MM, STIFFEST_N_PER_MM, Wall

Height = Annotated[
    float, key("above the origin of the rig's pose", unit="mm", ge=-LARGEST_MM, le=LARGEST_MM)
]
Stiffness = Annotated[float, key("of its spring", unit="N/mm", ge=1e-3, le=STIFFEST_N_PER_MM)]
Damping = Annotated[float, key("of its damper", unit="N·s/m", ge=0, le=100)]


@dataclass(frozen=True, kw_only=True)
class WallUnder(FileSection):
    """The wall under one texture; what it does not say is that of [wall]."""

    WHERE: ClassVar[str] = "[[wall.under]]"
    texture: Annotated[Label, key("one of the study's textures")]
    height_mm: Height | None = None
    stiffness_n_per_mm: Stiffness | None = None
    damping_n_s_per_m: Damping | None = None


@dataclass(frozen=True, kw_only=True)
class WallSection(FileSection):
    """The wall under all virtual surfaces of a study.

    It differs from texture to texture at most, never from model to model: participants would
    compare walls.
    """

    WHERE: ClassVar[str] = "[wall]"
    height_mm: (
        Annotated[
            float,
            key(
                "above the origin of the rig's pose; without it its `real_surface.offset_mm`, or 0",
                unit="mm",
                ge=-LARGEST_MM,
                le=LARGEST_MM,
            ),
        ]
        | None
    ) = None
    stiffness_n_per_mm: (
        Annotated[
            float,
            key(
                "of its spring; without it that of the rig's real surface, or half of the largest "
                "that its device renders stably",
                unit="N/mm",
                ge=1e-3,
                le=STIFFEST_N_PER_MM,
            ),
        ]
        | None
    ) = None
    damping_n_s_per_m: Damping = 0.0
    width_mm: Annotated[float, key("along x", unit="mm", ge=1, le=LARGEST_MM)] = 100.0
    length_mm: Annotated[float, key("along y", unit="mm", ge=1, le=LARGEST_MM)] = 100.0
    under: Annotated[tuple[WallUnder, ...], key("textures whose wall is another one")] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        names = [wall.texture for wall in self.under]
        if not is_different(names):
            raise InputError(
                f"expected one wall for each texture in [[wall.under]], got {', '.join(names)}; "
                "remove one of those that stand twice."
            )

    def check_textures(self, textures: Sequence[str]) -> None:
        """Refuse a wall under a texture that the study has not.

        Raises
        ------
        InputError
        """
        check_keys([wall.texture for wall in self.under], tuple(textures), where="[[wall.under]]")

    def walls(self, usual: Wall) -> tuple[Wall, dict[str, Wall]]:
        """The wall under most textures, and those of textures that have their own.

        Parameters
        ----------
        usual : Wall
            Whose height and stiffness count where the file says none.
        """
        stiffness, level = self.stiffness_n_per_mm, self.height_mm
        stiffness = usual.stiffness_n_per_mm if stiffness is None else stiffness
        level = usual.height_mm if level is None else level

        def wall(own: WallUnder | None = None) -> Wall:
            height, spring, damper = (
                (None, None, None)
                if own is None
                else (own.height_mm, own.stiffness_n_per_mm, own.damping_n_s_per_m)
            )
            return Wall(
                height_mm=level if height is None else height,
                stiffness_n_per_mm=stiffness if spring is None else spring,
                damping_n_s_per_m=self.damping_n_s_per_m if damper is None else damper,
                width_mm=self.width_mm,
                length_mm=self.length_mm,
            )

        return wall(), {own.texture: wall(own) for own in self.under}
