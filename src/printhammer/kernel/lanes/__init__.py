"""Many runs side by side: vector code, and the scalar loop over members."""
