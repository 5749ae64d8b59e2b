"""How far the relaxations reach: beside SCIP, beside linear programs, over thousands of samples, on named problems."""
