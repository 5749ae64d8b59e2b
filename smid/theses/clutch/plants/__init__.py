"""Six plants from pressure to position: the bundled one, and five whose formulas the sensors do not have.

`PLANTS` maps a name to a function of pressure (bar, shape (n,)), temperature (degC) and sampling time (s) that returns
the position in mm, shape (n,). The pressure is linear between samples. Use 0.1 ms.

"Dahl" is the plant of the bundled records (`smid.theses.clutch.position`): Dahl friction, a static curve, a lag. The
sensor PTX has these parts too. The foreign plants share none of its formulas: their piston (`piston`) has another
spring, other effects of temperature and another law of motion, and each has another hysteresis.
"""

from smid.theses.clutch.plants.registered import PLANTS, plant_records

__all__ = ["PLANTS", "plant_records"]
