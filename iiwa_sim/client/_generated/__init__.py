"""The methods of the clients, written from the tables in protocol/ by `python -m tools.client_source`."""
