"""States close their loops on the branch that was asked for, or name the joint that stays open."""
