"""URDF and MJCF files become the mechanisms that Pinocchio and MuJoCo make of them."""
