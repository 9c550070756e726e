"""The jobs of `riposte`: they may use any service, and no service uses them."""
