"""The page where one asks when object and interference can be told apart, and its figures."""
