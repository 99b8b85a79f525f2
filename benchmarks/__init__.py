"""What warpsim's speed is, measured on scenes built the way users build them: python -m benchmarks."""
