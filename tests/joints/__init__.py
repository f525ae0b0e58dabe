"""Every joint has the pose of its definition, in a tree and as a closure; rolling and paths by closed forms."""
