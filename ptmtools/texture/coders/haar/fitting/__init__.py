"""The weights of the Haar coder's predictors: only the encoder needs this."""
