"""Fur from one photograph (papers: section 3)."""
