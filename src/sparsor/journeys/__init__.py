"""The stages put together: plan a mission, learn a model. No algorithm of its own."""
