"""The strongest other forms of a BTF, each at a given number of bytes."""
