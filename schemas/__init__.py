"""What flows through Asset2Sim: frozen models, Arrow table schemas, settings and errors. Imports nothing of ours."""
