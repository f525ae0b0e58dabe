"""Wrong arguments of any public function are named, with the function that was asked."""
