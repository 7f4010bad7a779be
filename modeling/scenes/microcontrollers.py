from dataclasses import dataclass

from modeling.errors import InputError


@dataclass(frozen=True)
class MicroController:
    name: str
    core: str
    clock_hz: float
    memory_bytes: int
    cycles_per_operation: float
    source: str

    def operations_per_sample(self, rate_hz: float) -> float:
        return self.clock_hz / self.cycles_per_operation / rate_hz

    @staticmethod
    def named(name: str) -> "MicroController":
        if name == "stm32l432":
            return MicroController(name, "Cortex-M4F", 80e6, 65536, 3.0, "stub")
        raise InputError(f"expected a micro-controller among stm32l432, got {name!r}; choose one.")
