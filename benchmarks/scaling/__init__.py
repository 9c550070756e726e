"""How many actors a run can use: a model, what measures its coefficients, what checks it."""
