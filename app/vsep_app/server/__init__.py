"""The server: sessions, routes, health, patches of the libraries."""
