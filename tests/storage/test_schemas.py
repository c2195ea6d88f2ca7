"""Schemas: a dataset is stored as it is declared, or refused with a reason."""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np
import pytest
import xarray as xr

import storage.schemas
from storage.errors import SchemaError
from storage.schemas import Schema, Variable, find_schema, schemas_of

_SYSTEMS = sorted(
    module.name
    for module in pkgutil.iter_modules(storage.schemas.__path__)
    if hasattr(importlib.import_module(f"storage.schemas.{module.name}"), "SCHEMAS")
)
_ALL = [schema for system in _SYSTEMS for schema in schemas_of(system)]

_TOY = Schema(
    "toys",
    "spinning_top",
    7,
    "A toy.",
    {
        "angle": Variable(("time",), "float32", "degree", "Turned by", "section 2, Eq. 1"),
        "spins": Variable((), "bool", "1", "Whether it still spins"),
        "time": Variable(("time",), "float64", "s", "Since it was let go"),
        "weight": Variable((), "float64", "kg", "Weight", optional=True),
    },
)


def _toy() -> xr.Dataset:
    return xr.Dataset(
        {"angle": ("time", np.arange(3, dtype=np.float32)), "spins": ((), True)},
        coords={"time": np.arange(3.0)},
    )


def _filled(schema: Schema) -> xr.Dataset:
    """A dataset of zeros as the schema declares it."""
    lengths: dict[str, int] = {}
    for variable in schema.variables.values():
        for dim in variable.dims:
            lengths.setdefault(dim, len(lengths) + 2)
    return xr.Dataset(
        {
            name: (variable.dims, np.zeros([lengths[dim] for dim in variable.dims], variable.dtype))
            for name, variable in schema.variables.items()
        }
    )


def _refusal(schema: Schema, dataset: xr.Dataset) -> str:
    with pytest.raises(SchemaError) as caught:
        schema.conform(dataset)
    return str(caught.value)


def test_a_dataset_that_conforms_gets_its_attributes() -> None:
    conformed = _TOY.conform(_toy())
    xr.testing.assert_equal(conformed, _toy())
    assert conformed["angle"].attrs == {
        "long_name": "Turned by",
        "units": "degree",
        "source": "section 2, Eq. 1",
    }
    assert conformed["spins"].attrs == {"long_name": "Whether it still spins", "units": "1"}
    assert conformed["time"].attrs == {"long_name": "Since it was let go", "units": "s"}
    assert list(conformed.coords) == ["time"]


def test_attributes_of_the_caller_are_replaced_in_the_copy_only() -> None:
    given = _toy()
    given["angle"].attrs["units"] = "radian"
    assert _TOY.conform(given)["angle"].attrs["units"] == "degree"
    assert given["angle"].attrs == {"units": "radian"}
    assert given["spins"].attrs == {}


def test_a_lazy_dataset_stays_lazy() -> None:
    def fail(_: object) -> np.ndarray:
        raise AssertionError("conform computed a lazy dataset")

    lazy = _toy().chunk({"time": 1})
    lazy["angle"] = lazy["angle"].copy(data=lazy["angle"].data.map_blocks(fail, dtype=np.float32))
    assert _TOY.conform(lazy)["angle"].chunks == ((1, 1, 1),)


def test_an_optional_variable_may_be_there_or_not() -> None:
    assert "weight" not in _TOY.conform(_toy())
    assert _TOY.conform(_toy().assign(weight=0.5))["weight"].attrs["units"] == "kg"


def test_a_missing_variable_is_refused() -> None:
    message = _refusal(_TOY, _toy().drop_vars("spins"))
    assert message == (
        "toys/spinning_top: variable 'spins' is missing; expected bool () (schema 7)."
    )


def test_a_variable_that_is_not_declared_is_refused() -> None:
    message = _refusal(_TOY, _toy().assign(colour=1))
    assert "toys/spinning_top: variable 'colour' is present; expected no such" in message


def test_a_coordinate_that_is_not_declared_is_refused() -> None:
    assert "variable 'colour' is present" in _refusal(_TOY, _toy().assign_coords(colour=1))


@pytest.mark.parametrize("extra", ["weight", "spins"])
def test_other_dimensions_are_refused(extra: str) -> None:
    message = _refusal(_TOY, _toy().assign({extra: ("time", np.zeros(3))}))
    assert f"variable {extra!r} has dimensions ('time',); expected ()" in message


def test_transposed_dimensions_are_refused() -> None:
    schema = next(schema for schema in _ALL if schema.asset == "fur_photo")
    photo = _filled(schema).transpose("x", "y", "channel")
    message = _refusal(schema, photo)
    assert "'radiance' has dimensions ('x', 'y', 'channel')" in message
    assert "expected ('y', 'x', 'channel')" in message


@pytest.mark.parametrize("dtype", ["float64", "int32", "float16", "bool"])
def test_another_dtype_is_refused(dtype: str) -> None:
    message = _refusal(_TOY, _toy().assign(angle=("time", np.zeros(3, dtype))))
    assert f"variable 'angle' has dtype {dtype}; expected float32" in message


every_schema = pytest.mark.parametrize(
    "schema", _ALL, ids=lambda schema: f"{schema.system}-{schema.asset}"
)


@every_schema
def test_its_own_zeros_conform(schema: Schema) -> None:
    conformed = schema.conform(_filled(schema))
    for name, variable in schema.variables.items():
        assert conformed[name].attrs["long_name"] == variable.meaning
        assert conformed[name].attrs["units"] == variable.units
        assert conformed[name].attrs.get("source", "") == variable.source


@every_schema
def test_each_variable_is_demanded(schema: Schema) -> None:
    zeros = _filled(schema)
    for name, variable in schema.variables.items():
        without = zeros.drop_vars(name)
        if variable.optional:
            assert name not in schema.conform(without)
        else:
            assert f"{name!r} is missing" in _refusal(schema, without)


@every_schema
def test_each_dtype_and_dimension_is_demanded(schema: Schema) -> None:
    zeros = _filled(schema)
    for name, variable in schema.variables.items():
        other = "int16" if variable.dtype != "int16" else "int8"
        message = _refusal(schema, zeros.assign({name: zeros[name].astype(other)}))
        assert f"{name!r} has dtype {other}; expected {variable.dtype}" in message
        message = _refusal(schema, zeros.assign({name: zeros[name].expand_dims("more")}))
        assert f"{name!r} has dimensions ('more'," in message
        assert f"expected {variable.dims}" in message


@every_schema
def test_the_table_holds_every_variable(schema: Schema) -> None:
    header, rule, *rows = schema.markdown().splitlines()
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    assert header.count("|") == rule.count("|") == 6
    assert [row[0] for row in cells] == [f"`{name}`" for name in schema.variables]
    for row, variable in zip(cells, schema.variables.values(), strict=True):
        assert len(row) == 5, "expected no bar in a cell: it would cut the table"
        assert row[1] == (", ".join(variable.dims) if variable.dims else "scalar")
        assert row[2:4] == [variable.dtype, variable.units]
        assert variable.meaning in row[4]
        assert variable.source in row[4]
        assert ("*(where known)*" in row[4]) == variable.optional


@every_schema
def test_it_says_what_it_means(schema: Schema) -> None:
    assert schema.meaning.endswith(".")
    assert "\n" not in schema.meaning
    for variable in schema.variables.values():
        assert variable.meaning
        assert variable.units
        assert "\n" not in variable.meaning
        assert not variable.meaning.endswith(".")
        assert np.dtype(variable.dtype).kind in "biuf", "Zarr v3 holds numbers only"


@every_schema
def test_it_is_found_by_its_name(schema: Schema) -> None:
    assert find_schema(schema.system, schema.asset) is schema


def test_names_of_assets_are_unique() -> None:
    names = [(schema.system, schema.asset) for schema in _ALL]
    assert len(set(names)) == len(names) > 0


def test_an_asset_without_a_schema_is_named() -> None:
    with pytest.raises(KeyError, match="photo_fur/no_such_asset: no schema"):
        find_schema("photo_fur", "no_such_asset")
