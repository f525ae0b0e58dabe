"""Engines beside closed forms: inertia torques by orders, two inertias in torsion, flywheels by energy."""
