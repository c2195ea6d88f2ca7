"""How an asset's variables are declared, and what a dataset must be to be stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from storage.errors import SchemaError

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Variable:
    """One array of an asset."""

    dims: tuple[str, ...]
    dtype: str
    units: str
    meaning: str
    """One line; ends without a full stop."""
    source: str = ""
    """Paper and equation, where there is one."""
    optional: bool = False


@dataclass(frozen=True)
class Schema:
    """One asset's dataset."""

    system: str
    asset: str
    number: int
    """Raised whenever a stored dataset of the old form can no longer be read as the new one."""
    meaning: str
    variables: Mapping[str, Variable]

    def conform(self, dataset: xr.Dataset) -> xr.Dataset:
        """The dataset with long names, units and sources in its attributes.

        Raises SchemaError that names the variable, what was found and what was expected.
        """
        import numpy as np

        for name in dataset.variables:
            if name not in self.variables:
                raise self._error(str(name), "is present", "no such variable in the schema")
        variables = {}
        for name, expected in self.variables.items():
            if name not in dataset.variables:
                if not expected.optional:
                    raise self._error(name, "is missing", f"{expected.dtype} {expected.dims}")
                continue
            found = dataset.variables[name]
            if found.dims != expected.dims:
                raise self._error(name, f"has dimensions {found.dims}", str(expected.dims))
            if found.dtype != np.dtype(expected.dtype):
                raise self._error(name, f"has dtype {found.dtype}", expected.dtype)
            attributes = {"long_name": expected.meaning, "units": expected.units}
            if expected.source:
                attributes["source"] = expected.source
            variables[name] = found.copy(deep=False)
            variables[name].attrs = attributes
        return dataset.assign(
            {name: variable for name, variable in variables.items() if name in dataset.data_vars}
        ).assign_coords(
            {name: variable for name, variable in variables.items() if name in dataset.coords}
        )

    def markdown(self) -> str:
        """The variables as a Markdown table."""
        rows = ["| variable | dimensions | dtype | units | meaning |", "|---|---|---|---|---|"]
        for name, variable in self.variables.items():
            note = f" ({variable.source})" if variable.source else ""
            only = " *(where known)*" if variable.optional else ""
            dims = ", ".join(variable.dims) or "scalar"
            rows.append(
                f"| `{name}` | {dims} | {variable.dtype} | {variable.units} "
                f"| {variable.meaning}{note}{only} |"
            )
        return "\n".join(rows)

    def _error(self, name: str, found: str, expected: str) -> SchemaError:
        return SchemaError(
            f"{self.system}/{self.asset}: variable {name!r} {found}; expected {expected} "
            f"(schema {self.number})."
        )


def package_schema(system: str, asset: str, meaning: str) -> Schema:
    """The schema of an asset that holds a runtime package."""
    file = Variable(("byte",), "uint8", "1", "The package, a .tsuya file (docs/packages.md)")
    return Schema(system, asset, 1, meaning, {"file": file})
