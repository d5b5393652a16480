"""Odd inputs by the thousand, and random play: what the project promises of both, tried."""
