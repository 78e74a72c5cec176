"""The published study of Xie, Zhang & Zhou: its numbers, its figures from our datasets, and both side by side."""
