"""Systems: one population of mass points each, with its own step."""
