"""Static entropy coding of symbols of many contexts: `tables` chooses, `stream` codes."""
