"""Floor plans of a database, one for each of its storeys: `plan` draws them."""
