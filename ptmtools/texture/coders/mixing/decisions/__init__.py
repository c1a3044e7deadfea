"""Binary decisions: adaptive probabilities, the mixer, the arithmetic coder."""
