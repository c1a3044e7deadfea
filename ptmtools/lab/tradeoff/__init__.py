"""What every stage's knobs buy: cost against error on the user's own scene."""
