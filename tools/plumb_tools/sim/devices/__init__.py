"""Simulated flights as the bytes their devices would have sent, written from the data sheets and from nothing else.

Each module of a device turns measurements into what arrives on its bus and when; `log.write_log` puts them into an LCM
event log. They share no code with the drivers that read them: what the two agree on, the data sheet says.
"""
