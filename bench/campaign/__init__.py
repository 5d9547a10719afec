"""The measuring campaign's parts; bench/campaign.py is its command."""
